"""MPEG-4 AFX SimpleTexture: reference views with depth from models and photographs, packed, baked, drawn.

    import stx
    bundle = stx.convert("amphora.obj", views="sphere:16", size=(512, 512))
    camera = stx.Camera.look_at((1.5, 1.2, 2.5), (0, 0.5, 0))
    stx.render(bundle, camera).save("novel.png")

It does what the program stx does, with the same results to the byte. Lengths are in scene units, angles in
degrees, sizes in pixels. Cameras look along -Z with +X right and +Y up; pixel (0, 0) is the top-left one and its
centre is (0.5, 0.5); depth is planar, the distance to the plane through the viewpoint parallel to the image.
Arrays that objects give show their memory: they are read-only and keep it alive.

Calls raise stx.Error, give notes as warnings of kind stx.Note (or to their job), let other threads of Python work,
and stop within a second when Ctrl-C is pressed; what writes .mp4, .xmt or .bt, with the view that it writes.
"""
from __future__ import annotations

import numbers
import os
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, Union, overload

from . import _stx
from ._stx import (Atlas, AtlasPage, Background, Bundle, Camera, Comparison, Film, Frame, Job, Light, Mesh, Model, View,
                   __version__)
from .errors import Error, ErrorCode, Note

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

__all__ = ["Atlas", "AtlasPage", "Background", "Bundle", "Camera", "Comparison", "Error", "ErrorCode", "Film", "Frame", "Job",
           "Light", "Mesh", "Model", "Note", "View", "background", "bake", "compare", "convert", "open", "open_film", "orbit",
           "pack", "render", "unpack", "__version__"]

Path = Union[str, "os.PathLike[str]"]


def _is_path(value: object) -> bool:
    return isinstance(value, (str, os.PathLike))


def _is_number(value: object) -> bool:
    """Whether it is one number, as Python or numpy has it."""
    return isinstance(value, numbers.Real) or getattr(value, "ndim", None) == 0


def _given(function: Any, options: dict[str, Any]) -> list[str]:
    """The keywords of a function that have another value than they have by default."""
    usual = function.__kwdefaults__
    same = {name: value == usual[name] for name, value in options.items()}
    # Arrays are compared element by element; no default is one.
    return [name for name, equal in same.items() if getattr(equal, "ndim", 0) > 0 or not equal]


def _model(value: Any, *kinds: type, job: Job | None = None, materials: bool = False) -> Any:
    """A model, opened (a mesh with its materials) where it is the name of a file; TypeError unless it is one of the kinds."""
    if _is_path(value):
        value = _stx.open(value, {"materials": materials}, job)
    if not isinstance(value, kinds):
        names = ", ".join("stx." + kind.__name__ for kind in kinds)
        raise TypeError(f"this is {type(value).__name__}; {names} or the name of its file is expected")
    return value


def open(path: Path, *, texture: str | None = None, materials: bool = False, from_: str | None = None, frame: int = 0,
         moving: bool | None = None, every: int = 1, strict: bool = False, depth: str | None = None, mask: str | None = None,
         depth_range: tuple[float, float] | None = None, depth_unit: float | None = None, no_depth: str | None = None,
         intrinsics: Sequence[float] | None = None, focal: float | None = None, baseline: float | None = None,
         fov: float | None = None, depth_bits: int = 16, deep_colour: bool = False, refine: str = "auto",
         job: Job | None = None) -> Mesh | Bundle | Atlas:
    """Opens a mesh (glTF, OBJ, PLY, STL, ...), a bundle (.mp4, .xmt, .bt, .exr), an image set or an atlas.

    texture: of a mesh, in place of those that it names; of an image set the pattern of its pictures' names.
    materials: a mesh's metallic-roughness is read, too. Of image sets: from_: the kind ('transforms', 'colmap', ...;
    None: recognised). frame: of those with time, from 0. moving: pictures with times are of a scene that moves.
    every: takes each N-th view. strict: what is missing is an error, not a note. depth, mask: patterns of names.
    depth_range: (nearest, farthest), scene units, and depth_unit: scene units a step, where the set says neither.
    no_depth: what pixels without depth are, 'empty' or 'unknown'. intrinsics: fx, fy, cx, cy in pixels. focal:
    pixels, and baseline: scene units, of older Middlebury sets. fov: of a photo, vertical, degrees. depth_bits: 8, 16
    or 32 (floats). deep_colour: pictures of 16 bits become linear floats, of which they come back to the bit, and are
    not rounded to 8. refine: steps that are done at the import, as in 'auto', 'off', 'noise,edges'.
    Keywords that do not matter to what is opened are noted; frame of a film is an error: open_film() has its frames.
    Raises Error: io, invalidInput (with byte offset, line or key), usage, unsupported.
    """
    options = {name: value for name, value in locals().items() if name not in ("path", "job")}
    model: Mesh | Bundle | Atlas = _stx.open(path, {**options, "given": _given(open, options)}, job)
    return model


def open_film(path: Path, *, from_: str | None = None, moving: bool | None = None, strict: bool = False,
              texture: str | None = None, depth: str | None = None, mask: str | None = None,
              depth_range: tuple[float, float] | None = None, depth_unit: float | None = None, no_depth: str | None = None,
              depth_bits: int = 16, deep_colour: bool = False, refine: str = "auto", job: Job | None = None) -> Film:
    """Opens what holds views in time: .mp4, .xmt, .bt, an image set, 'name_%04d.exr', 'atlas_%04d'.

    What stands still is one frame. No picture is read before a frame is asked for. Keywords and errors: as open().
    """
    options = {name: value for name, value in locals().items() if name not in ("path", "job")}
    return _stx.open_film(path, {**options, "given": _given(open_film, options)}, job)


def convert(model: Path | Mesh | Bundle | Atlas, *, views: str = "sphere:16", cameras: Sequence[Camera] = (),
            names: Sequence[str] = (), size: tuple[int, int] = (512, 512), orthographic: bool | None = None,
            fov: float = 35.0, elevation: float = 15.0, up: ArrayLike | None = None, supersampling: int = 4,
            mesh_normals: bool = False, materials: bool = False, depth_bits: int | None = None, title: str = "",
            job: Job | None = None) -> Bundle:
    """Captures a mesh from all sides; takes the views out of an atlas; gives a bundle other depth bits.

    views: 'cube', 'ring:N', 'sphere:N', 'octahedral:N', 'hemi-octahedral:N' (N x N), 'auto:N' (the N best) or
    'auto:DBdB' (the fewest that reach a PSNR). cameras: the views themselves, in place of views and the framing; names:
    of these views. size: (width, height) of each view, pixels. orthographic: None: only faces of a cube are. fov: the
    angle that the object fills, degrees above 0 and below 170. elevation: of a ring, degrees. up: (3,), what views
    stand on (None: +Y, of clouds of splats their own). supersampling: colour samples per pixel and axis, 1..8.
    mesh_normals, materials: these are kept as images. depth_bits: 8, 16 or 32 (None: 16, a bundle's own). title: of the
    bundle (a mesh: its file's name). Raises Error: usage, invalidInput, failed.
    """
    options = {name: value for name, value in locals().items() if name not in ("model", "job")}
    options["cameras"], options["names"] = list(cameras), list(names)
    return _stx.convert(_model(model, Mesh, Bundle, Atlas, job=job, materials=materials), options, job)


@overload
def bake(bundle: Path | Bundle, *, method: str = ..., discontinuity: float = ..., keep_normals: bool = ...,
         job: Job | None = ...) -> Bundle: ...
@overload
def bake(bundle: Film, *, method: str = ..., discontinuity: float = ..., keep_normals: bool = ...,
         job: Job | None = ...) -> Film: ...
def bake(bundle: Path | Bundle | Film, *, method: str = "robust", discontinuity: float = 0.01, keep_normals: bool = False,
         job: Job | None = None) -> Bundle | Film:
    """Normals and splat axes from depth, as a new bundle; of a film of each frame, when it is read.

    method: 'robust' (respects edges and steps of depth) or 'paper' (Lee & Park). discontinuity: relative difference of
    depth that parts two surfaces, above 0, at most 1. keep_normals: those that views have are kept.
    Raises Error: usage, invalidInput, failed.
    """
    options = {"method": method, "discontinuity": discontinuity, "keep_normals": keep_normals}
    if isinstance(bundle, Film):
        return _stx.bake_film(bundle, options)
    return _stx.bake(_model(bundle, Bundle, job=job), options, job)


def pack(bundle: Path | Bundle, *, layout: str = "grid", padding: int = 2, max_size: int = 16384, prune: bool = False,
         budget: int = 0, job: Job | None = None) -> Atlas:
    """Merges the views of a bundle into at most four textures: colour, depth, normal, splat.

    layout: 'grid' (equal cells in view order) or 'tight' (trimmed and fitted). padding: pixels around each rectangle,
    0..64. max_size: largest side of a texture, pixels, 1..65535. prune: pixels that other views show as well are left
    out. budget: object pixels to keep at most (0: no limit). Raises Error: usage, invalidInput, failed.
    """
    options = {name: value for name, value in locals().items() if name not in ("bundle", "job")}
    return _stx.pack(_model(bundle, Bundle, job=job), options, job)


def unpack(atlas: Path | Atlas, *, job: Job | None = None) -> Bundle:
    """The bundle of an atlas: every pixel of every rectangle back in its view. Raises Error: invalidInput."""
    return _stx.unpack(_model(atlas, Atlas, job=job), job)


@overload
def background(source: Film, *, support: float = ..., key_views: int = ..., job: Job | None = ...) -> Film: ...
@overload
def background(source: Path | Sequence[Path] | NDArray[np.uint8], *, method: str = ..., frames: int = ...,
               job: Job | None = ...) -> Background: ...
def background(source: Film | Path | Sequence[Path] | NDArray[np.uint8], *, support: float = 0.04, key_views: int = 8,
               method: str = "select", frames: int = 0, job: Job | None = None) -> Film | Background:
    """What cameras see without those who pass.

    Of a film (stx.Film): the film with a view more for each camera that stands still and for a few poses of those that
    move; support: share of the frames that must show a surface, above 0, at most 1; key_views: poses at most, 1..64.
    Of plain video of a camera that stands still, a Background; source: (n, height, width, 3 or 4) uint8, the names of
    pictures, or a folder, 'frame_%04d.png' or a film's name; transparent pixels do not count; method: 'select' (the
    best), 'n2pg' (which refuses transparent pixels) or 'median'; frames: how many to look at, spread evenly, from 2
    (0: all). Raises Error: usage, invalidInput, io, unsupported.
    """
    moving, plain = {"support": support, "key_views": key_views}, {"method": method, "frames": frames}
    for name in _given(background, plain if isinstance(source, Film) else moving):
        of = "plain video, whose background is a picture" if name in plain else "a stx.Film; open one by stx.open_film()"
        raise Error(ErrorCode.usage, f"{name} is of {of}")
    if isinstance(source, Film):
        return _stx.background_of_film(source, moving, job)
    inputs: Any = [source] if _is_path(source) else source
    if isinstance(inputs, Iterator):
        inputs = list(inputs)
    if not hasattr(inputs, "dtype") and not (isinstance(inputs, Iterable) and all(map(_is_path, inputs))):
        raise TypeError(f"this is {type(source).__name__}; a stx.Film, an array of frames or names of files are expected")
    return _stx.still_background(inputs, plain, job)


def orbit(model: Path | Mesh | Bundle | Atlas, count: int, *, elevation: float = 15.0, start: float = 0.0, arc: float = 360.0,
          radius: float | None = None, target: ArrayLike | None = None, up: ArrayLike | None = None,
          size: tuple[int, int] = (512, 512), fov: float = 40.0) -> list[Camera]:
    """Cameras on a circle around a model, counter-clockwise from above.

    count: from 1. elevation: above the horizon, start: of the first, from the front, arc: how far, all in degrees; less
    than 360: the last camera is at its end. radius: scene units (None: the model fills the picture). target: (3,), what
    they look at (the model's middle). up: (3,), the circle's axis (model.up). size: (width, height), pixels. fov:
    vertical, degrees above 0 and below 180. Raises Error: usage.
    """
    options = {name: value for name, value in locals().items() if name != "model"}
    return _stx.orbit(_model(model, Mesh, Bundle, Atlas), options)


@overload
def render(model: Path | Model, cameras: Camera, *, job: Job | None = ..., **drawing: Any) -> Frame: ...
@overload
def render(model: Path | Model, cameras: Iterable[Camera], *, job: Job | None = ..., **drawing: Any) -> Iterator[Frame]: ...
@overload
def render(model: Film, cameras: Camera, *, times: float, job: Job | None = ..., **drawing: Any) -> Frame: ...
@overload
def render(model: Film, cameras: Camera | Iterable[Camera], *, times: Iterable[float] | None = ...,
           job: Job | None = ..., **drawing: Any) -> Iterator[Frame]: ...
def render(  # type: ignore[misc]  # the overloads leave out the keywords below
           model: Path | Model | Film, cameras: Camera | Iterable[Camera], *,
           times: float | Iterable[float] | None = None, mode: str = "surface", quality: str = "normal", backend: str = "auto",
           device: int = -1, normals: bool = False, fill: str = "background", environment: Path | bool | None = None,
           lights: Sequence[Light] = (), ambient: ArrayLike = 0.2, specular: ArrayLike = 0.0, shininess: float = 32.0,
           beyond_one: bool = False, splat: str = "data", splat_coefficient: float = 0.0, refine: str = "auto", without: Sequence[str] = (),
           job: Job | None = None) -> Frame | Iterator[Frame]:
    """Draws a model: one Frame for a camera, an iterator of Frames, each drawn when it is asked for, for several.

    times: of a film, seconds by its clock (None: all its frames; outside it the nearest, with a note): one time, or as
    many as there are cameras, or either of them once. mode: 'surface' or 'splat'. quality: of surface mode, 'normal' or 'best'. backend: 'auto', 'cpu', 'gpu'
    or 'gl'; device: number of the GPU (-1: the best). normals: frames have normals and albedo, too, as 'stx render'
    writes them into .exr. fill: what no view shows: 'background', 'spatial' or 'none'. environment: a file that is shown
    behind everything; False: not even the model's own. lights: stx.Light; with them ambient and specular: grey or (r, g, b), linear, from 0; shininess: Phong
    exponent above 0; beyond_one: lit colours do not end at 1, as those that 'stx render' writes into .exr. splat: of splat mode, 'data', 'paper' (with splat_coefficient, pixels times scene units, 0: fitted)
    or 'point'. refine: repairs of captured depth, 'auto', 'off' or steps. without: names of stages that are left out.
    Raises Error: usage, invalidInput (a camera), unsupported (a backend), failed.
    """
    drawing = {name: value for name, value in locals().items() if name not in ("model", "cameras", "times", "job")}
    given = _given(render, drawing)
    drawing["lights"] = list(lights)
    drawing["without"] = without.split(",") if isinstance(without, str) else list(without)
    single = isinstance(cameras, Camera)
    path = [cameras] if isinstance(cameras, Camera) else list(cameras)
    for camera in path:
        if not isinstance(camera, Camera):
            raise TypeError(f"cameras holds {type(camera).__name__}; stx.Camera is expected")
    if isinstance(model, Film):
        moments = _moments(model, times, len(path), job)
        _note_unused(Bundle, given, mode, job)
        pictures = _draw_film(model, path * (len(moments) // max(1, len(path))), moments, drawing, job)
        single = single and _is_number(times)
    elif times is not None:
        raise TypeError("times are of a stx.Film; open it by stx.open_film()")
    else:
        drawn = _model(model, Mesh, Bundle, Atlas, job=job)
        # Wrong settings are errors now, not when the first picture is asked for.
        pictures = _draw(_stx.Renderer(drawn, drawing, job), path, job)
        _note_unused(type(drawn), given, mode, job)
    return next(pictures) if single else pictures


def _note_unused(kind: type, given: list[str], mode: str, job: Job | None) -> None:
    """Notes keywords of render() that do not matter to this kind of model and mode, as the program does."""
    if kind is Mesh:
        of = ["mode", "backend", "device", "splat", "splat_coefficient", "fill", "refine", "without"]
        why = "a mesh is rasterised itself, on the processor"
    elif mode == "splat":
        of, why = ["quality"], "it is of mode surface"
    else:
        of, why = ["splat", "splat_coefficient"], "they are of mode splat"
    unused = [name for name in given if name in of]
    if unused:
        _stx.note(f"{', '.join(unused)} {'is' if len(unused) == 1 else 'are'} not used: {why}", job)


def _moments(film: Film, times: float | Iterable[float] | None, cameras: int, job: Job | None) -> list[float]:
    """A time for each picture."""
    wanted: Any = film.times if times is None else times
    moments = [float(wanted)] if _is_number(wanted) else [float(time) for time in wanted]
    _stx.check_times(film, moments, job)
    if len(moments) == 1:
        moments *= cameras
    if cameras not in (1, len(moments)):
        raise Error(ErrorCode.usage, f"{cameras} cameras and {len(moments)} times; one camera, one time, or as many of both are "
                                     "expected")
    return moments


def _draw(renderer: Any, cameras: list[Camera], job: Job | None) -> Iterator[Frame]:
    for i, camera in enumerate(cameras):
        yield renderer.render(camera, cameras[i + 1] if i + 1 < len(cameras) else None, job)


def _draw_film(film: Film, cameras: list[Camera], moments: list[float], drawing: dict[str, Any],
               job: Job | None) -> Iterator[Frame]:
    shown = None
    renderer: Any = None
    for camera, moment in zip(cameras, moments):
        number = film.frame_at(moment)
        if number != shown:
            shown, renderer = number, None
            renderer = _stx.Renderer(film.frame(number, job=job), drawing, job)
        yield renderer.render(camera, None, job)


def compare(a: Path | Frame | NDArray[np.uint8] | NDArray[np.float32], b: Path | Frame | NDArray[np.uint8] | NDArray[np.float32],
            *, mask: NDArray[np.bool_] | NDArray[np.uint8] | None = None, background: ArrayLike = 0.0,
            job: Job | None = None) -> Comparison:
    """PSNR, SSIM and the worst pixel of two pictures of one size.

    a, b: a file, a Frame (as its PNG), or (height, width, 3 or 4) uint8 (sRGB) or float32 (linear light), straight
    alpha. As floats when both are, by codes of 16 bits when one is a file of these, else as 8-bit sRGB. mask: (height,
    width) bool or uint8: only pixels of True, or of 128 and more, count. background: grey or (r, g, b), sRGB-coded, 0..1,
    laid behind both. Raises Error: usage, io, invalidInput, unsupported.
    """
    return _stx.compare(a, b, mask, background, job)
