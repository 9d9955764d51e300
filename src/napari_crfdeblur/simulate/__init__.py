"""The path run forwards: scene, blur, response, noise, quantization."""

from .camera import Camera, Simulated, simulate
from .motion import CameraMotion, camera_turn
from .profiles import ProfileCase, random_profiles
from .scenes import Scene, TrueEdge, slanted_edges, step_image
from .street import street

__all__ = [
    "Camera",
    "CameraMotion",
    "ProfileCase",
    "Scene",
    "Simulated",
    "TrueEdge",
    "camera_turn",
    "random_profiles",
    "simulate",
    "slanted_edges",
    "step_image",
    "street",
]
