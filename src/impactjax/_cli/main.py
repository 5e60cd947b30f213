"""The command `impactjax`."""

from importlib.metadata import version
from typing import Annotated

import typer

from impactjax._cli.check import check_command
from impactjax._cli.compiler_flags import prepare
from impactjax._cli.design import design_command
from impactjax._cli.fit import fit_command
from impactjax._cli.identifiability import identifiability_command
from impactjax._cli.retry_after_abort import attempted
from impactjax._cli.simulate import simulate_command
from impactjax._cli.thesis import thesis_command

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    help="What an impact is made of: contact parameters from a recording, with honest errors.",
)


def _print_version(wanted: bool) -> bool:
    if wanted:
        typer.echo(f"impactjax {version('impactjax')}")
        raise typer.Exit
    return wanted


_VERSION = typer.Option(
    "--version", callback=_print_version, is_eager=True, help="Show the version and exit."
)


@app.callback()
def _common(version: Annotated[bool, _VERSION] = False) -> None:
    del version


app.command("check")(check_command)
app.command("design")(design_command)
app.command("fit")(fit_command)
app.command("identifiability")(identifiability_command)
app.command("simulate")(simulate_command)
app.command("thesis")(thesis_command)


def main() -> None:
    """Entry point of the command."""
    prepare()
    attempted(app)
