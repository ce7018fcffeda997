"""The studio: a page on which a picture becomes a solver file. Needs the extra `studio`; nothing else imports it.

`server` speaks HTTP and guards, `sessions` keeps one worker process a page, `worker` runs the pipeline in it. `recipe`
says what was clicked as a command, as Python and as a script. `packing` turns results into arrays for the page, `www`.
"""
