"""Ways to turn (12) into finitely many equations: one file each, one protocol."""

from .collocation import Collocation
from .discretisation import Discretisation, Phases, Profile, Transcription
from .shooting import Shooting
from .spectral import Spectral

__all__ = ["Collocation", "Discretisation", "Phases", "Profile", "Shooting", "Spectral", "Transcription"]
