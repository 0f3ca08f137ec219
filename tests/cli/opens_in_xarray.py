#!/usr/bin/python3
"""A study's netCDF opens in xarray without help, and holds what the CSV does.

opens_in_xarray.py TWILIGHT; exit code 77 and a reason where xarray is missing.
"""
import csv
import pathlib
import subprocess
import sys
import tempfile

try:
    import netCDF4  # noqa: F401, the reader of CDF-5
    import xarray
except ImportError as missing:
    print(f"SKIP: {missing}")
    sys.exit(77)

STUDY = """
[atmosphere]
layers = 10
[aerosols]
type = "none"
[spectrum]
wavelengths_nm = [450, 550, 650]
[solver]
method = "orders"
zenith_step_deg = 3
altitude_levels = 8
polar_directions = 8
azimuth_directions = 4
sunlight_nodes = 64
view_interpolation = false
[outputs]
quantities = ["texture", "radiance", "illuminance"]
texture_size = 8
picture_size = 0
[[axis]]
key = "atmosphere.profile"
values = ["us_standard", "tropical"]
[[axis]]
key = "sun.elevation_deg"
values = [9, -4]
"""

with tempfile.TemporaryDirectory(prefix="twilight xarray ") as name:
    folder = pathlib.Path(name)
    (folder / "study.toml").write_text(STUDY)
    subprocess.run([sys.argv[1], "study", folder / "study.toml", "-o", folder / "out", "--quiet"],
                   check=True)
    skies = xarray.open_dataset(folder / "out" / "study.nc")
    assert skies.texture.dims[:2] == ("atmosphere_profile", "sun_elevation_deg"), skies.texture.dims
    assert skies.texture.shape == (2, 2, 3, 8, 8), skies.texture.shape
    assert list(skies.sun_elevation_deg.values) == [9.0, -4.0]
    assert list(skies.wavelength.values) == [450.0, 550.0, 650.0]
    assert skies.illuminance.attrs["units"] in ("lux", "lx"), skies.illuminance.attrs
    with open(folder / "out" / "study.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 4
    for row in rows:
        # Words are selected as words.
        light = skies.illuminance.sel(atmosphere_profile=row["atmosphere.profile"],
                                      sun_elevation_deg=float(row["sun.elevation_deg"]))
        assert float(light) == float(row["illuminance (lux)"]), (row, float(light))
