"""`python -m hcpg`: the same as the command `hcpg`."""

import sys

from hcpg.cli import main

if __name__ == "__main__":
    sys.exit(main())
