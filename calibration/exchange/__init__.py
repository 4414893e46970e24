"""Reading and writing stereo rigs in the file formats of OpenCV, Kalibr and ROS."""
