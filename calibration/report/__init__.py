"""HTML report of a calibration: verdict, figures and plots for the person who accepts it."""
