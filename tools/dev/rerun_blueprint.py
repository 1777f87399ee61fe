"""Make `tools/view/push.rbl`, Rerun's layout of the same panels, with an interpreter that has `rerun-sdk`.

uvx --from rerun-sdk==0.41.0 --with rerun-sdk==0.41.0 python -m tools.dev.rerun_blueprint tools/view/push.rbl
"""

from __future__ import annotations

import sys
from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb
from rerun.blueprint.encodings import ComponentSourceKind, VisualizerComponentMapping

from tools.view.panels import PLOTS, RERUN_APPLICATION, SIGNALS_TOPIC, SIGNALS_TYPE, STATES, Plot, contents


def blueprint() -> rrb.Blueprint:
    """Return the layout: on the left the scene above phase and mode, on the right the plots."""
    eye = rrb.EyeControls3D(position=(-2.0, -4.0, 3.0), look_target=(1.5, 0.0, 0.0))
    scene = rrb.Spatial3DView(name="scene", origin="/", eye_controls=eye)
    closed = rrb.components.PanelState.Collapsed
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(scene, _states(), row_shares=[3, 1]), rrb.Vertical(*[_plot(plot) for plot in PLOTS])
        ),
        rrb.TimePanel(state=closed),
        rrb.BlueprintPanel(state=closed),
        rrb.SelectionPanel(state=closed),
    )


def _plot(plot: Plot) -> rrb.TimeSeriesView:
    lines = [
        rr.SeriesLines(names=[line.name]).visualizer(mappings=[_mapping("Scalars:scalars", line.field)])
        for line in plot.lines
    ]
    return rrb.TimeSeriesView(
        name=plot.title,
        origin=SIGNALS_TOPIC,
        contents=[SIGNALS_TOPIC],
        axis_x=_whole_log(),
        overrides={SIGNALS_TOPIC: lines},
    )


def _states() -> rrb.StateTimelineView:
    bars = []
    for field, labels in STATES.items():
        bar = rr.StateChange().visualizer(mappings=[_mapping("StateChange:state", field)])
        names = rr.StateConfiguration(values=[str(number) for number in range(len(labels))], labels=labels)
        bar.overrides = [*(bar.overrides or ()), *names.as_component_batches()]
        bars.append(bar)
    return rrb.StateTimelineView(
        name=" and ".join(STATES),
        origin=SIGNALS_TOPIC,
        contents=[SIGNALS_TOPIC],
        time_view=_whole_log(),
        overrides={SIGNALS_TOPIC: bars},
    )


def _mapping(target: str, field: str) -> VisualizerComponentMapping:
    return VisualizerComponentMapping(
        target=target,
        source_kind=ComponentSourceKind.SourceComponent,
        source_component=f"{SIGNALS_TYPE.replace('/', '.')}:message",
        selector=f".{field}",
    )


def _whole_log() -> rrb.archetypes.TimeAxis:
    no_end = rr.TimeRangeBoundary.infinite()
    return rrb.archetypes.TimeAxis(view_range=rr.TimeRange(start=no_end, end=no_end))


if __name__ == "__main__":
    out = Path(sys.argv[1])
    blueprint().save(RERUN_APPLICATION, str(out))
    out.with_name(f"{out.name}.txt").write_text(contents())
