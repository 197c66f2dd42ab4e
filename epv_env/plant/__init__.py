"""The valve itself: parameters, state equations, fast event-exact simulation."""
