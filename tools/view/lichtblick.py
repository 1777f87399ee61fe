"""The layout for Lichtblick and Foxglove: the JSON that their menu for layouts imports."""

from __future__ import annotations

from typing import Any

from tools.view.panels import DESCRIPTION_TOPIC, PATH_TOPIC, PLOTS, SIGNALS_TOPIC, STATES, Plot

SCENE_PANEL, STATES_PANEL = "3D!scene", "StateTransitions!states"
_FOLLOWED_FRAME = "base_link"


def layout() -> dict[str, Any]:
    """Return the layout: on the left the scene above phase and mode, on the right the plots, one below the other."""
    plots = {f"Plot!{i}": _plot(plot) for i, plot in enumerate(PLOTS)}
    return {
        "configById": {SCENE_PANEL: _scene(), STATES_PANEL: _states(), **plots},
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": {
            "direction": "row",
            "first": {"direction": "column", "first": SCENE_PANEL, "second": STATES_PANEL, "splitPercentage": 75},
            "second": _column(list(plots)),
            "splitPercentage": 50,
        },
    }


def paths(found: dict[str, Any]) -> list[str]:
    """Return every message path and topic that a layout reads."""
    panels = found["configById"].values()
    values = [line["value"] for panel in panels for line in panel.get("paths", ())]
    topics = [topic for panel in panels for topic in panel.get("topics", ())]
    layers = [layer["topic"] for panel in panels for layer in panel.get("layers", {}).values() if layer.get("topic")]
    return [*values, *topics, *layers]


def _plot(plot: Plot) -> dict[str, Any]:
    return {
        "title": plot.title,
        "paths": [
            {
                "value": f"{SIGNALS_TOPIC}.{line.field}",
                "label": line.name,
                "enabled": True,
                "timestampMethod": "receiveTime",
            }
            for line in plot.lines
        ],
        "xAxisVal": "timestamp",
        "isSynced": True,
        "showLegend": True,
        "legendDisplay": "floating",
        "showXAxisLabels": True,
        "showYAxisLabels": True,
    }


def _states() -> dict[str, Any]:
    return {
        "isSynced": True,
        "paths": [
            {"value": f"{SIGNALS_TOPIC}.{field}", "label": field, "timestampMethod": "receiveTime"} for field in STATES
        ],
    }


def _scene() -> dict[str, Any]:
    """Return the 3-D panel, which follows the base from behind and above; distances in m, angles in degrees."""
    return {
        "cameraState": {
            "distance": 5.0,
            "perspective": True,
            "phi": 55.0,
            "thetaOffset": 60.0,
            "target": [0.0, 0.0, 0.0],
            "targetOffset": [0.6, 0.0, 0.0],
            "targetOrientation": [0.0, 0.0, 0.0, 1.0],
            "fovy": 45.0,
            "near": 0.1,
            "far": 500.0,
        },
        "followMode": "follow-position",
        "followTf": _FOLLOWED_FRAME,
        "scene": {},
        "transforms": {},
        "topics": {PATH_TOPIC: {"visible": True}},
        "layers": {
            "grid": {
                "layerId": "foxglove.Grid",
                "instanceId": "grid",
                "label": "floor",
                "visible": True,
                "frameLocked": True,
                "size": 20,
                "divisions": 20,
                "lineWidth": 1,
                "color": "#80808080",
                "position": [0, 0, 0],
                "rotation": [0, 0, 0],
            },
            "robot": {
                "layerId": "foxglove.Urdf",
                "instanceId": "robot",
                "label": "robot and object",
                "visible": True,
                "frameLocked": True,
                "sourceType": "topic",
                "topic": DESCRIPTION_TOPIC,
                "framePrefix": "",
                "displayMode": "auto",
            },
        },
    }


def _column(panels: list[str]) -> Any:
    """Return panels of the same height, one below the other."""
    if len(panels) == 1:
        return panels[0]
    share = 100 / len(panels)
    return {"direction": "column", "first": panels[0], "second": _column(panels[1:]), "splitPercentage": share}
