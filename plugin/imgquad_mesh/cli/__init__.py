"""The command `imgquad-mesh`: one module a subcommand, each with `add_parser` and `execute`."""
