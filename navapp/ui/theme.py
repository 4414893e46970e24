"""The colour theme: dark; green, amber and red also differ in brightness."""

from textual.theme import Theme

NAVAPP_THEME = Theme(
    name="navapp",
    primary="#86b6d6",
    secondary="#5b7d94",
    accent="#86b6d6",
    foreground="#d3dae1",
    background="#0d1217",
    surface="#0d1217",
    panel="#1b242d",
    # Relative luminance about 0.65, 0.47 and 0.17: told apart without hue; the 16
    # colours of old terminals make them green, yellow and red.
    success="#9fe0b5",
    warning="#e0b020",
    error="#d8433b",
    dark=True,
    variables={
        "text-muted": "#8493a1",
        "text-disabled": "#566370",
        "text-on-error": "#ffffff",
        "frame": "#3a4753",
    },
)
