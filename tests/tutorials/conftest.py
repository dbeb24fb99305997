from tests.robots.conftest import start

__all__ = ["start"]
