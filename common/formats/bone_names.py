"""Names of the skeleton's bones in other conventions."""

from collections.abc import Mapping
from typing import Literal

BoneNames = Literal["zenocap", "vrm"]

UNITY_NAMES: Mapping[str, str] = {  # names in Unity's HumanBodyBones, where they differ from ours
    "Spine1": "Chest",
    "LeftArm": "LeftUpperArm",
    "LeftForeArm": "LeftLowerArm",
    "LeftUpLeg": "LeftUpperLeg",
    "LeftLeg": "LeftLowerLeg",
    "RightArm": "RightUpperArm",
    "RightForeArm": "RightLowerArm",
    "RightUpLeg": "RightUpperLeg",
    "RightLeg": "RightLowerLeg",
}


def unity_name(bone: str) -> str:
    """Name of a bone in Unity's HumanBodyBones."""
    return UNITY_NAMES.get(bone, bone)


def vrm_name(bone: str) -> str:
    """Name of a bone in VRM 1.0 (section Humanoid), which begins with a small letter."""
    name = unity_name(bone)
    return name[0].lower() + name[1:]
