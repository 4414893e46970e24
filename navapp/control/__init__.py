"""Session controller, states, stages, interlocks, events and the recorder."""
