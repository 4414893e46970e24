"""From pictures of a target to a judged stereo rig."""
