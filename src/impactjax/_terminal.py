"""Progress of long work, shown on a terminal."""

import contextlib
from collections.abc import Callable, Iterator


@contextlib.contextmanager
def telling(name: str) -> Iterator[Callable[[str], None]]:
    """A function that shows what is done at the moment, beside a name and the elapsed time. Nothing
    is shown if the standard error is no terminal.
    """
    from rich.console import Console
    from rich.markup import escape
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    columns = SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn()
    progress = Progress(*columns, console=console, transient=True, disable=not console.is_terminal)
    with progress as bar:
        display = bar.add_task(escape(name), total=None)
        yield lambda what: bar.update(display, description=f"{escape(name)}: {escape(what)}")
