"""The session: controller, states, stages, tracks of bones, interlocks, events and recorder."""
