"""`python -m impactjax` is the command `impactjax`."""

from impactjax._cli.main import main

main()
