"""What the command writes: files as wholes, the report, the drawing of a mesh."""
