"""Localization, initialization from the T-pose, body fitting, relocalization."""
