"""impactjax: what an impact is made of.

Simulate free flight and contact, exactly differentiable through every impact; fit the contact's
parameters with intervals that keep their promise; learn which of them a record cannot tell.
"""

import sys
import typing

from impactjax import io as io
from impactjax import plot as plot
from impactjax._analytic.exact_flight import ExactFlight as ExactFlight
from impactjax._analytic.flight import AbstractFlight as AbstractFlight
from impactjax._analytic.multiple_scales import MultipleScales as MultipleScales
from impactjax._analytic.multiple_scales_flight import MultipleScalesFlight as MultipleScalesFlight
from impactjax._analytic.piecewise import PiecewiseAnalytical as PiecewiseAnalytical
from impactjax._analytic.piecewise import piecewise_analytical as piecewise_analytical
from impactjax._analytic.successive_peaks import Rebound as Rebound
from impactjax._analytic.successive_peaks import successive_peaks as successive_peaks
from impactjax._check.check import Check as Check
from impactjax._check.check import check as check
from impactjax._compare.across import Across as Across
from impactjax._compare.across import across as across
from impactjax._compare.compare import compare as compare
from impactjax._compare.comparison import Comparison as Comparison
from impactjax._compare.comparison import Fitted as Fitted
from impactjax._compare.laws import *  # noqa: F403  all contact laws, which that file lists
from impactjax._compare.oscillators import OSCILLATORS as OSCILLATORS
from impactjax._compare.prepare import Prepared as Prepared
from impactjax._compare.prepare import prepare as prepare
from impactjax._compare.repeatability import Repeatability as Repeatability
from impactjax._compare.repeatability import RepeatedModel as RepeatedModel
from impactjax._compare.repeatability import RepeatedParameter as RepeatedParameter
from impactjax._compare.repeatability import repeatability as repeatability
from impactjax._design.candidates import Between as Between
from impactjax._design.candidates import Candidates as Candidates
from impactjax._design.criterion import AbstractCriterion as AbstractCriterion
from impactjax._design.criterion import AOptimal as AOptimal
from impactjax._design.criterion import DOptimal as DOptimal
from impactjax._design.criterion import Within as Within
from impactjax._design.criterion import WorstParameter as WorstParameter
from impactjax._design.design import design as design
from impactjax._design.plan import Design as Design
from impactjax._design.plan import Expected as Expected
from impactjax._design.plan import Performance as Performance
from impactjax._fit.bootstrap import Bootstrap as Bootstrap
from impactjax._fit.bootstrap import bootstrap as bootstrap
from impactjax._fit.estimate import Estimate as Estimate
from impactjax._fit.fit import fit as fit
from impactjax._fit.fit_data import fit_data as fit_data
from impactjax._fit.fit_in_segments import fit_in_segments as fit_in_segments
from impactjax._fit.fit_together import fit_together as fit_together
from impactjax._fit.fit_together import of_experiment as of_experiment
from impactjax._fit.fitted_parameter import FittedParameter as FittedParameter
from impactjax._fit.learn import learn as learn
from impactjax._fit.learned import Learned as Learned
from impactjax._fit.left_out import left_out as left_out
from impactjax._fit.left_out import with_left_out as with_left_out
from impactjax._fit.profile import profiled as profiled
from impactjax._fit.random_effects import RandomEffects as RandomEffects
from impactjax._fit.reason import Reason as Reason
from impactjax._fit.scatter_found import Scatter as Scatter
from impactjax._fit.score_test import HeldParameter as HeldParameter
from impactjax._fit.starts import Starts as Starts
from impactjax._fit.synthetic import synthetic as synthetic
from impactjax._fit.used_prior import UsedPrior as UsedPrior
from impactjax._fit.verdict import Verdict as Verdict
from impactjax._hybrid.event_log import EventLog as EventLog
from impactjax._hybrid.lane import Start as Start
from impactjax._hybrid.reset import Reset as Reset
from impactjax._hybrid.reset import ResetAt as ResetAt
from impactjax._hybrid.section import Section as Section
from impactjax._hybrid.section import section as section
from impactjax._hybrid.solution import Solution as Solution
from impactjax._hybrid.solve import solve as solve
from impactjax._hybrid.solve_events import EventSolution as EventSolution
from impactjax._hybrid.solve_events import solve_events as solve_events
from impactjax._hybrid.surface import AtTransition as AtTransition
from impactjax._hybrid.surface import Every as Every
from impactjax._hybrid.surface import Through as Through
from impactjax._hybrid.system import HybridSystem as HybridSystem
from impactjax._hybrid.system import Tail as Tail
from impactjax._hybrid.system import Transition as Transition
from impactjax._identify.contact_outcomes import Accuracy as Accuracy
from impactjax._identify.couplings import Couplings as Couplings
from impactjax._identify.couplings import couplings as couplings
from impactjax._identify.directions import Directions as Directions
from impactjax._identify.experiment_information import information as information
from impactjax._identify.identifiability import identifiability as identifiability
from impactjax._identify.information import Information as Information
from impactjax._identify.information_in import information_in as information_in
from impactjax._identify.joint_information import joint_information as joint_information
from impactjax._identify.posterior import posterior as posterior
from impactjax._identify.predicted import predicted as predicted
from impactjax._identify.profile_curve import Profile as Profile
from impactjax._identify.profile_shape import ProfileShape as ProfileShape
from impactjax._identify.profiles import profiles as profiles
from impactjax._identify.residual_diagnostics import ResidualDiagnostics as ResidualDiagnostics
from impactjax._identify.residual_diagnostics import residual_diagnostics as residual_diagnostics
from impactjax._identify.restitution_band import restitution_band as restitution_band
from impactjax._identify.ridge import Ridge as Ridge
from impactjax._identify.ridge import ridge as ridge
from impactjax._identify.structure import Structure as Structure
from impactjax._identify.structure import Told as Told
from impactjax._identify.structure import structure as structure
from impactjax._identify.structure import structure_in as structure_in
from impactjax._identify.words import Finding as Finding
from impactjax._identify.words import coupling as coupling
from impactjax._identify.words import findings as findings
from impactjax._mechanics.mechanical_system import MechanicalSystem as MechanicalSystem
from impactjax._mechanics.mechanism import AbstractMechanism as AbstractMechanism
from impactjax._mechanics.mechanism import Contact as Contact
from impactjax._mechanics.mechanism import Friction as Friction
from impactjax._mechanics.motion import MechanicalState as MechanicalState
from impactjax._mechanics.oscillator_mechanism import OscillatorMechanism as OscillatorMechanism
from impactjax._model.base_motion import AbstractBaseMotion as AbstractBaseMotion
from impactjax._model.base_motion import Chirp as Chirp
from impactjax._model.base_motion import HarmonicMotion as HarmonicMotion
from impactjax._model.bouncing_ball import BouncingBall as BouncingBall
from impactjax._model.equilibrium import AbstractEquilibrium as AbstractEquilibrium
from impactjax._model.equilibrium import Hanging as Hanging
from impactjax._model.equilibrium import Inverted as Inverted
from impactjax._model.equivalents import Equivalents as Equivalents
from impactjax._model.free_mass import FreeMass as FreeMass
from impactjax._model.impact_oscillator import ImpactOscillator as ImpactOscillator
from impactjax._model.initial_state import InitialState as InitialState
from impactjax._model.law import AbstractForceLaw as AbstractForceLaw
from impactjax._model.law import AbstractImpactLaw as AbstractImpactLaw
from impactjax._model.law import AbstractMemorylessLaw as AbstractMemorylessLaw
from impactjax._model.learned_restitution import LearnedRestitution as LearnedRestitution
from impactjax._model.linear_oscillator import LinearOscillator as LinearOscillator
from impactjax._model.measured_motion import MeasuredMotion as MeasuredMotion
from impactjax._model.oscillator import AbstractOscillator as AbstractOscillator
from impactjax._model.pendulum import Pendulum as Pendulum
from impactjax._model.separation import AbstractSeparation as AbstractSeparation
from impactjax._model.separation import AtZeroForce as AtZeroForce
from impactjax._model.separation import AtZeroPenetration as AtZeroPenetration
from impactjax._model.stop import Stop as Stop
from impactjax._optimise.levenberg_marquardt import LevenbergMarquardt as LevenbergMarquardt
from impactjax._outcome import Outcome as Outcome
from impactjax._parameter import as_optional_parameter as as_optional_parameter
from impactjax._parameter import as_parameter as as_parameter
from impactjax._parameter import parameter as parameter
from impactjax._problem.build_problem import build_problem as build_problem
from impactjax._problem.data_problem import DataProblem as DataProblem
from impactjax._problem.experiment import Experiment as Experiment
from impactjax._problem.loss import AbstractLoss as AbstractLoss
from impactjax._problem.loss import Cauchy as Cauchy
from impactjax._problem.loss import SoftL1 as SoftL1
from impactjax._problem.loss import Squares as Squares
from impactjax._problem.loss import StudentT as StudentT
from impactjax._problem.noise import AbstractNoise as AbstractNoise
from impactjax._problem.noise import AutoregressiveNoise as AutoregressiveNoise
from impactjax._problem.noise import WhiteNoise as WhiteNoise
from impactjax._problem.prior import Normal as Normal
from impactjax._problem.problem import Problem as Problem
from impactjax._problem.scatter import AbstractScatter as AbstractScatter
from impactjax._problem.scatter import NormalScatter as NormalScatter
from impactjax._problem.scatter import NoScatter as NoScatter
from impactjax._record.abstract_recording import AbstractRecording as AbstractRecording
from impactjax._record.impact_times import ImpactTimes as ImpactTimes
from impactjax._record.planned import planned as planned
from impactjax._record.planned import planned_impacts as planned_impacts
from impactjax._record.recording import Recording as Recording
from impactjax._response.basins import Attractor as Attractor
from impactjax._response.basins import Basins as Basins
from impactjax._response.basins import basins as basins
from impactjax._response.branch import Branch as Branch
from impactjax._response.branch import SpecialPoint as SpecialPoint
from impactjax._response.delay_embedding import DelayEmbedding as DelayEmbedding
from impactjax._response.delay_embedding import Divergence as Divergence
from impactjax._response.delay_embedding import delay_embedding as delay_embedding
from impactjax._response.delay_embedding import divergence as divergence
from impactjax._response.diagram import AbstractSweep as AbstractSweep
from impactjax._response.diagram import Diagram as Diagram
from impactjax._response.diagram import FreshStarts as FreshStarts
from impactjax._response.diagram import WithMemory as WithMemory
from impactjax._response.diagram import diagram as diagram
from impactjax._response.doubled import doubled as doubled
from impactjax._response.exponents import Exponents as Exponents
from impactjax._response.follow import follow as follow
from impactjax._response.lyapunov import lyapunov as lyapunov
from impactjax._response.lyapunov import lyapunov_diagram as lyapunov_diagram
from impactjax._response.orbit import Orbit as Orbit
from impactjax._response.orbit import OrbitEvents as OrbitEvents
from impactjax._response.periodic_orbit import periodic_orbit as periodic_orbit
from impactjax._response.special_curve import SpecialCurve as SpecialCurve
from impactjax._response.special_curve import special_curve as special_curve
from impactjax._results import RESULTS as RESULTS
from impactjax._sensor.abstract_quantity import AbstractQuantity as AbstractQuantity
from impactjax._sensor.impulse_response import ImpulseResponse as ImpulseResponse
from impactjax._sensor.low_pass import AbstractLowPass as AbstractLowPass
from impactjax._sensor.low_pass import Butterworth as Butterworth
from impactjax._sensor.low_pass import Resonance as Resonance
from impactjax._sensor.quantity import QUANTITIES as QUANTITIES
from impactjax._sensor.quantity import Acceleration as Acceleration
from impactjax._sensor.quantity import Angle as Angle
from impactjax._sensor.quantity import AngularAcceleration as AngularAcceleration
from impactjax._sensor.quantity import AngularVelocity as AngularVelocity
from impactjax._sensor.quantity import ContactForce as ContactForce
from impactjax._sensor.quantity import Displacement as Displacement
from impactjax._sensor.quantity import ProperAcceleration as ProperAcceleration
from impactjax._sensor.quantity import Velocity as Velocity
from impactjax._sensor.sensor import Sensor as Sensor
from impactjax._series.held import held as held
from impactjax._series.recurrences.series import NotAnalytic as NotAnalytic
from impactjax._simulate.chatter import Chatter as Chatter
from impactjax._simulate.coefficients import Coefficients as Coefficients
from impactjax._simulate.coefficients import (
    coefficients_of_restitution as coefficients_of_restitution,
)
from impactjax._simulate.impact_log import ImpactLog as ImpactLog
from impactjax._simulate.jumps import Jumps as Jumps
from impactjax._simulate.lane_state import LaneState as LaneState
from impactjax._simulate.rest_log import RestLog as RestLog
from impactjax._simulate.runge_kutta import RungeKutta as RungeKutta
from impactjax._simulate.simulate import simulate as simulate
from impactjax._simulate.simulation import Simulation as Simulation
from impactjax._simulate.single_impact import single_impact as single_impact
from impactjax._simulate.step import AbstractStep as AbstractStep
from impactjax._simulate.taylor_step import TaylorStep as TaylorStep
from impactjax._simulate.trajectory import Stats as Stats
from impactjax._simulate.trajectory import Trajectory as Trajectory
from impactjax._study.design import AbstractDesign as AbstractDesign
from impactjax._study.grid import Grid as Grid
from impactjax._study.progress import Progress as Progress
from impactjax._study.ranges import LogUniform as LogUniform
from impactjax._study.saltelli import Saltelli as Saltelli
from impactjax._study.samples import LatinHypercube as LatinHypercube
from impactjax._study.samples import SobolSequence as SobolSequence
from impactjax._study.sobol_indices import SobolIndices as SobolIndices
from impactjax._study.sobol_indices import sobol_indices as sobol_indices
from impactjax._study.study import study as study
from impactjax._study.study_error import StudyError as StudyError
from impactjax._study.study_result import Study as Study

if typing.TYPE_CHECKING:
    __version__: str
    from impactjax._simulate.taylor_solver import Taylor as Taylor


def __dir__() -> list[str]:
    return [*sorted(vars(sys.modules[__name__])), "Taylor", "__version__"]


def __getattr__(name: str) -> object:
    """Lazy access to the version and to the solver for Diffrax, which take time to import."""
    if name == "__version__":
        from importlib.metadata import version

        return version("impactjax")
    if name != "Taylor":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from impactjax._simulate.taylor_solver import Taylor

    return Taylor
