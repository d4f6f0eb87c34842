"""Prediction and optimisation behind the predictive controllers."""
