"""Figures, each a function of an `Axes` that it draws on and returns."""

from impactjax._report.check_figure import plot_check as check
from impactjax._report.coupling_figures import plot_correlation as correlation
from impactjax._report.coupling_figures import plot_directions as directions
from impactjax._report.coupling_figures import plot_sensitivities as sensitivities
from impactjax._report.couplings_figure import plot_couplings as couplings
from impactjax._report.design_figure import plot_design as design
from impactjax._report.fit_figures import plot_fit as fit
from impactjax._report.fit_figures import plot_residuals as residuals
from impactjax._report.profile_figures import plot_profile as profile
from impactjax._report.profile_figures import plot_ridge as ridge
from impactjax._report.repeats_figure import plot_repeats as repeats
from impactjax._report.residual_figures import plot_autocorrelation as autocorrelation
from impactjax._report.residual_figures import plot_impact_residuals as impact_residuals
from impactjax._report.residual_figures import plot_quantiles as quantiles
from impactjax._report.response_figures import plot_basins as basins
from impactjax._report.response_figures import plot_branch as branch
from impactjax._report.response_figures import plot_diagram as diagram
from impactjax._report.response_figures import plot_divergence as divergence
from impactjax._report.response_figures import plot_exponents as exponents
from impactjax._report.response_figures import plot_spectrum as spectrum
from impactjax._report.restitution_figure import plot_learned_restitution as learned_restitution
from impactjax._report.restitution_figure import plot_restitution as restitution
from impactjax._report.search_figures import plot_first_look as first_look
from impactjax._report.search_figures import plot_starts as starts

__all__ = [
    "autocorrelation",
    "basins",
    "branch",
    "check",
    "correlation",
    "couplings",
    "design",
    "diagram",
    "directions",
    "divergence",
    "exponents",
    "first_look",
    "fit",
    "impact_residuals",
    "learned_restitution",
    "profile",
    "quantiles",
    "repeats",
    "residuals",
    "restitution",
    "ridge",
    "sensitivities",
    "spectrum",
    "starts",
]
