"""Allow for the product's time limits, which the tests wait out."""

from tests.patience import patient_limits

__all__ = ["patient_limits"]
