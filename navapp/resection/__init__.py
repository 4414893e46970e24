"""What has been cut, drilled and put in: the bone that is left, and what was made against plan."""
