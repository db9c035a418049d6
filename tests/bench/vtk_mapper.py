# SPDX-License-Identifier: Apache-2.0
"""VTK's CPU ray caster (vtkFixedPointVolumeRayCastMapper) on a scene of vtk.py, without a display."""
import ctypes
import time

import numpy
import vtkmodules.vtkRenderingVolumeOpenGL2  # without it, the mapper's constructor ends the process
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkVersion
from vtkmodules.vtkCommonDataModel import vtkImageData, vtkPiecewiseFunction
from vtkmodules.vtkIOImage import vtkNIFTIImageReader
from vtkmodules.vtkRenderingCore import (vtkCamera, vtkColorTransferFunction, vtkLight, vtkRenderer, vtkRenderWindow,
                                         vtkVolume, vtkVolumeProperty)
from vtkmodules.vtkRenderingVolume import vtkFixedPointVolumeRayCastMapper

ONE = 32767  # 1.0 in the mapper's pictures
VERSION = vtkVersion().GetVTKVersion()


def read_nifti(path):
    """Voxels as the file stores them, indexed [z, y, x]."""
    reader = vtkNIFTIImageReader()
    reader.SetFileName(path)
    reader.Update()
    image = reader.GetOutput()
    return vtk_to_numpy(image.GetPointData().GetScalars()).reshape(image.GetDimensions()[::-1]).copy()


def linear(color):
    """Linear RGB of "#rrggbb"."""
    coded = [int(color[i:i + 2], 16) / 255 for i in (1, 3, 5)]
    return [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in coded]


def opacity_of(channel):
    """Opacity per unit length. The mapper interpolates linearly in a table, but 1 - exp(-extinction) is not linear, so
    the table has an entry for every value that the mapper distinguishes (at most 2^15)."""
    lo, hi = channel["range"]
    positions = numpy.linspace(0, 1, min(int(hi - lo), 32768) + 1)
    extinctions = channel["density"] * numpy.interp(positions, *zip(*channel["opacity"]))
    function = vtkPiecewiseFunction()
    function.BuildFunctionFromTable(lo, hi, len(positions), (1 - numpy.exp(-extinctions)).tolist())
    return function


def color_of(channel):
    lo, hi = channel["range"]
    function = vtkColorTransferFunction()
    for position, color in channel["colormap"]:
        function.AddRGBPoint(lo + position * (hi - lo), *linear(color))
    return function


def property_of(scene):
    look = vtkVolumeProperty()
    look.IndependentComponentsOn()
    look.SetInterpolationTypeToLinear()
    for n, channel in enumerate(scene["channels"]):
        look.SetScalarOpacity(n, opacity_of(channel))
        look.SetScalarOpacityUnitDistance(n, 1)
        look.SetColor(n, color_of(channel))
        look.SetShade(n, scene["shading"])
        # Scolopax's defaults.
        look.SetAmbient(n, 0.3)
        look.SetDiffuse(n, 0.7)
        look.SetSpecular(n, 0.2)
        look.SetSpecularPower(n, 20)
    return look


def image_of(channels):
    """A VTK image with voxel (0, 0, 0) at the origin, spacing 1, and interleaved channels."""
    image = vtkImageData()
    image.SetDimensions(*channels[0].shape[::-1])
    voxels = numpy.stack([channel.ravel() for channel in channels], axis=-1)
    image.GetPointData().SetScalars(numpy_to_vtk(voxels, deep=True))
    return image


class VtkMapper:
    """Renders `channels` (arrays [z, y, x] of one type) according to `scene`."""

    def __init__(self, channels, scene):
        camera = vtkCamera()
        camera.SetPosition(scene["camera"]["eye"])
        camera.SetFocalPoint(scene["camera"]["target"])
        camera.SetViewUp(scene["camera"]["up"])
        camera.SetViewAngle(scene["camera"]["fovY"])
        camera.SetClippingRange(1, 1e4)
        light = vtkLight()
        light.SetPosition(scene["camera"]["eye"])
        light.SetFocalPoint(scene["camera"]["target"])
        self.window = vtkRenderWindow()
        self.window.SetSize(scene["image"]["width"], scene["image"]["height"])
        self.renderer = vtkRenderer()
        self.renderer.SetActiveCamera(camera)
        self.renderer.AddLight(light)
        self.window.AddRenderer(self.renderer)
        self.mapper = vtkFixedPointVolumeRayCastMapper()  # uses all cores
        self.mapper.SetInputData(image_of(channels))
        self.mapper.SetImageSampleDistance(1)
        self.mapper.AutoAdjustSampleDistancesOff()
        self.volume = vtkVolume()
        self.volume.SetMapper(self.mapper)
        self.volume.SetProperty(property_of(scene))

    def draw(self, step):
        """Seconds of the ray casting: the part of the mapper's Render() before the picture goes to OpenGL, which would
        need a display. The first call also prepares the data: gradients, and blocks to skip."""
        self.mapper.SetSampleDistance(step)
        begin = time.perf_counter()
        self.mapper.PerImageInitialization(self.renderer, self.volume, 0, [0] * 3, [0] * 3, [0] * 6)
        self.mapper.PerVolumeInitialization(self.renderer, self.volume)
        self.mapper.PerSubVolumeInitialization(self.renderer, self.volume, 0)
        self.mapper.RenderSubVolume()
        return time.perf_counter() - begin

    def picture(self):
        """Premultiplied linear RGBA of the last draw(), [y, x, 4] from the top left."""
        drawn = self.mapper.GetRayCastImage()
        width, height = drawn.GetImageViewportSize()
        (stored_width, stored_height), (used_width, used_height) = drawn.GetImageMemorySize(), drawn.GetImageInUseSize()
        x, y = drawn.GetImageOrigin()
        # VTK passes a C pointer to Python as the string "_<16 hex digits>_p_void".
        address = int(drawn.GetImage()[1:17], 16)
        words = numpy.ctypeslib.as_array((ctypes.c_uint16 * (stored_width * stored_height * 4)).from_address(address))
        used = words.reshape(stored_height, stored_width, 4)[:used_height, :used_width]
        picture = numpy.zeros((height, width, 4), numpy.float32)
        picture[y:y + used_height, x:x + used_width] = used / ONE
        return picture[::-1]
