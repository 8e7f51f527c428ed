"""One file per subcommand of `hcpg`; each has `run(arguments) -> exit code`."""
