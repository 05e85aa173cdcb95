"""`python -m squeal` is the command line."""

import sys

from squeal.cli.main import main

sys.exit(main())
