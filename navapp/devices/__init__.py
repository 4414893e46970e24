"""Opens the devices that a configuration names; the only package that does."""

from navapp.devices.cameras import make_real_camera
from navapp.devices.capture import OpenedCapture, open_capture
from navapp.devices.latency import OpenedLatency, open_latency
from navapp.devices.mirror_alignment import OpenedAlignment, open_mirror_alignment
from navapp.devices.peripherals import read_display_name, read_projector
from navapp.devices.session_devices import (
    OpenedDevices,
    make_memory_devices,
    open_live,
    open_recording,
)
from navapp.devices.simulated_mirror import make_practice_display
from navapp.devices.simulated_patient import SimulatedPatient, make_simulated_patient
from navapp.devices.simulated_room import Simulation

__all__ = [
    "OpenedAlignment",
    "OpenedCapture",
    "OpenedDevices",
    "OpenedLatency",
    "SimulatedPatient",
    "Simulation",
    "make_memory_devices",
    "make_practice_display",
    "make_real_camera",
    "make_simulated_patient",
    "open_capture",
    "open_latency",
    "open_live",
    "open_mirror_alignment",
    "open_recording",
    "read_display_name",
    "read_projector",
]
