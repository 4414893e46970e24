"""The tutorial on the live screens: what to do now, and what the session has reached."""
