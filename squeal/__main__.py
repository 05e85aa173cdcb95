"""`python -m squeal` is the command line."""

import sys

from squeal.commands.cli import main

sys.exit(main())
