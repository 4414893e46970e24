"""The judge as a rejector, and how far its bounds can be believed."""
