"""The sliders of a rig, by which gains are judged: in the warning of `push run`, doctor, reports and `push tune`."""

from __future__ import annotations

from collections.abc import Sequence

from robot_io.rig.config import RigConfig
from sim_backend.physics.assumed_sliders import AssumedSlider, Turning, assumed_sliders, samples
from sim_backend.physics.floor import FloorEffects
from sim_backend.physics.slider import Circle, Pressure, Rectangle
from sim_backend.world.scene import slider_model
from tools.rig import devices_at


def rig_sliders(rig: RigConfig) -> list[AssumedSlider]:
    """Return the sliders of `[sliders]`, judged along the push, and the simulated one, if any, by its own floor.

    Raises ConfigError if the simulated one would tip over.
    """
    lengths = samples(rig.sliders.shortest_m, rig.sliders.longest_m)
    outlines = [outline for length in lengths for outline in (Rectangle(length, length), Circle(length / 2))]
    sliders = sliders_of(rig, outlines, [rig.sliders.pressure])
    if not devices_at(rig, "hardware"):
        world = rig.world
        shape = slider_model(world.slider).shape
        assert isinstance(shape, Circle | Rectangle)
        turning: Turning = "ellipsoid" if world.floor.turning == "ellipsoid" else "along-push"
        simulated = AssumedSlider(shape, world.slider.pressure, _effects(rig), world.ball_radius_m).on(turning)
        simulated.body()
        sliders.append(simulated)
    return sliders


def sliders_of(
    rig: RigConfig, outlines: Sequence[Circle | Rectangle], pressures: Sequence[Pressure]
) -> list[AssumedSlider]:
    """Return sliders of these outlines and pressures on the rig's floor, pushed at its height; none that tips over."""
    return assumed_sliders(outlines, pressures, _effects(rig), rig.world.ball_radius_m)


def _effects(rig: RigConfig) -> FloorEffects:
    return FloorEffects(
        shift_m=rig.world.slider.floor_friction * rig.push_height_m,
        turning="along-push",
        along_over_across=rig.world.floor.along_over_across,
    )
