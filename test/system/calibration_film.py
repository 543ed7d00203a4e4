"""A camera that is calibrated in two places, and how far the results are apart."""

# For alidade-simulate; JSON is YAML.
FOCAL_LENGTH_PX = 900
FILM = {
    "seed": 3, "duration_s": 8, "image": {"width": 320, "height": 180, "rate_hz": 25},
    "camera": {"focal_length_px": FOCAL_LENGTH_PX, "radial_distortion": 1.7, "line_delay_us": 75,
               "pan_axis_mrad": [-12, 5], "tilt_axis_mrad": [-4, 14], "clock_offset_ms": -84.4},
    "path": {"type": "triple_cosine", "amplitude": 1, "period_s": 7},
    "sensor": {"exposure_ms": 1, "read_noise": 1.5, "jpeg_quality": 90},
    "telemetry": {"rate_hz": 50, "sigma_rad": 2e-4},
    "timing": {"image_jitter": {"sigma_ms": 0.3}, "telemetry_jitter": {"sigma_ms": 0.3}},
    "scene": {"procedural": [{"width_deg": 360, "height_deg": 180, "projection": "equirectangular"}]},
}


def sigmas_apart(here, there):
    """(name, difference in sigmas) of what `alidade calibrate --json` said in two places."""
    for name in ("focal_length", "radial_distortion", "line_delay", "clock_offset"):
        a, b = here["calibration"][name], there["calibration"][name]
        yield name, abs(a["value"] - b["value"]) / a["sigma"]
