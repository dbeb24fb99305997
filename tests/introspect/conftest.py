"""Limits of the product are waited out."""

from tests.patience import patient_limits

__all__ = ["patient_limits"]
