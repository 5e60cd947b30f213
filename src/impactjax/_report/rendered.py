"""Pages from templates."""

from impactjax._report.versions import versions


def rendered(template: str, **values: object) -> str:
    """A page from a template of this package, with the versions of the software."""
    import jinja2  # imported only when needed

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("impactjax", "_report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
    )
    return environment.get_template(template).render(versions=versions(), **values)
