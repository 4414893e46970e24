"""Checks that the configured devices are connected, without starting any."""

from pathlib import Path

from drivers.discovery.permissions import make_permission_remedy, may_use
from drivers.v4l_names import V4lNames
from drivers.window_outputs import choose_output
from navapp.config import Configuration
from navapp.errors import NavappError
from navapp.inventory.connected_devices import Inventory
from navapp.inventory.finding import Finding, Health, judge_health

_LOOK = "connect it, or choose another one: navapp devices lists what there is"


def check_configured_devices(
    configuration: Configuration, found: Inventory, names: V4lNames | None = None
) -> list[Finding]:
    """Camera, display, projector and mirror of the configuration."""
    return [
        *_camera(configuration, found, names or V4lNames()),
        _display(configuration, found),
        _projector(configuration),
        _mirror(configuration),
    ]


def _camera(configuration: Configuration, found: Inventory, names: V4lNames) -> list[Finding]:
    section = configuration.camera
    if section.backend == "simulated":
        return [Finding("camera", Health.OK, "simulated")]
    if section.backend == "opencv":
        eyes = {"camera, left": section.opencv.left, "camera, right": section.opencv.right}
        return [
            _usb_camera(name, wanted, names) for name, wanted in eyes.items() if wanted is not None
        ]
    if section.backend == "depthai":
        return [_oak_camera(section.depthai.device, found)]
    return [_check_package_camera(section.backend, found)]


def _usb_camera(name: str, wanted: str, names: V4lNames) -> Finding:
    if not wanted:
        return Finding(name, Health.FAILED, "[camera.opencv] names none", _LOOK)
    try:
        camera = names.find(wanted)
    except NavappError as error:
        return Finding(name, Health.FAILED, error.problem, error.remedy)
    if not may_use(camera.node):
        detail = f"{wanted} is {camera.node}, but this user may not open it"
        return Finding(name, Health.FAILED, detail, make_permission_remedy(camera.node, "video"))
    return Finding(name, Health.OK, f"{wanted} is {camera.node}")


def _oak_camera(wanted: str, found: Inventory) -> Finding:
    ids = [camera.device_id for camera in found.oak_cameras.found]
    fitting = [one for one in ids if wanted in ("", one)]
    listed = f"connected: {', '.join(ids) or 'none'}"
    if len(fitting) == 1:
        return Finding("camera", Health.OK, f"OAK camera {fitting[0]} is connected")
    if fitting:
        detail = f"several OAK cameras, and [camera.depthai] device names none ({listed})"
        return Finding("camera", Health.FAILED, detail, "name one of them")
    for why in found.oak_cameras.unseen:
        return Finding("camera", Health.FAILED, why.problem, why.remedy)
    detail = f"OAK camera {wanted}".strip() + f" is not connected ({listed})"
    return Finding("camera", Health.FAILED, detail, _LOOK)


def _check_package_camera(backend: str, found: Inventory) -> Finding:
    for camera in found.installed_cameras.found:
        if camera.backend == backend:
            detail = f"'{backend}' is brought by {camera.package}, which alone knows its devices"
            return Finding("camera", Health.OK, detail)
    for why in found.installed_cameras.unseen:
        if why.subject == f"camera.{backend}":
            return Finding("camera", Health.FAILED, why.problem, why.remedy)
    remedy = "use simulated, opencv or depthai, or install the package that provides it"
    return Finding("camera", Health.FAILED, f"there is no camera backend '{backend}'", remedy)


def _display(configuration: Configuration, found: Inventory) -> Finding:
    section = configuration.display
    if section.backend == "simulated" or section.size_px is None:
        return Finding("display", Health.OK, "simulated")
    for why in found.displays.unseen:
        if not found.displays.found:
            return Finding("display", Health.FAILED, why.problem, why.remedy)
    try:
        output = choose_output(found.displays.found, section.output, *section.size_px)
    except NavappError as error:
        return Finding("display", Health.FAILED, error.problem, error.remedy)
    return Finding("display", Health.OK, f"{output} is connected")


def _projector(configuration: Configuration) -> Finding:
    section = configuration.projector
    if section.backend == "pjlink":
        return _on_network("projector", f"{section.host}:{section.tcp_port}")
    if section.backend == "escvp21":
        return _on_port("projector", section.port)
    return Finding("projector", Health.OK, "none")


def _mirror(configuration: Configuration) -> Finding:
    section = configuration.mirror
    if section.backend == "zaber":
        return _on_port("mirror", section.port)
    return Finding("mirror", Health.OK, f"fixed at {section.calibrated_deg:g} deg")


def _on_port(name: str, port: str) -> Finding:
    """What is behind a port is not asked: a running session talks there."""
    if "://" in port:
        return _on_network(name, port.partition("://")[2])
    path = Path(port)
    if not path.exists():
        return Finding(name, Health.FAILED, f"there is no port {port}", _LOOK)
    is_fine = may_use(path)
    detail = f"the port {port} is there" + ("" if is_fine else ", but this user may not open it")
    remedy = "" if is_fine else make_permission_remedy(path, "dialout")
    return Finding(name, judge_health(is_fine, True), detail, remedy)


def _on_network(name: str, address: str) -> Finding:
    detail = f"at {address} on the network, not asked: it may serve a running session alone"
    return Finding(name, Health.WARNING, detail, "navapp run asks it when it starts")
