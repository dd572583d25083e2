"""Pictures changed by chance while a network learns: on the batch, anew at every update, so no copies are kept.

What changes is what changes before a camera and leaves the work as it is: light and its colour, focus, noise, where the
work is in the picture and how large, what hides a bit of it, and what is behind it.
"""

import math

import torch
from torch import Tensor
from torch.nn import functional

#: The most that each may change at strength 1. Brightness: either way, on a scale of logarithms (x 0.45 to x 2.2 before
#: it is clipped); hue: share of the colour circle; noise: grey levels of 255; shift and the occluder's longest side:
#: shares of the picture; zoom: share; rotation: degrees.
BRIGHTNESS, HUE, NOISE, SHIFT, ZOOM, ROTATION, OCCLUDER = math.log(2.2), 0.12, 12.0, 0.09, 0.12, 6.0, 0.14
#: Chances that what is behind the work is replaced, that something hides a bit, that the picture is out of focus.
BACKGROUND, HIDDEN, BLURRED = 0.5, 0.4, 0.3
#: Chance that all views of a piece of work stay as they are.
UNCHANGED = 0.3
#: Chance that the work is not there at all: then what is right most often is learned, and to be no surer than that.
NOTHING = 0.05
#: Pixels this near to the mean of a picture's corners are behind the work (grey levels; the style `varied` has noise).
NEAR = 40.0


def augmented(pictures: Tensor, strength: float = 1.0) -> Tensor:
    """Pictures uint8 (B, V, H, W, 3), changed by draws of torch's generator, which the caller seeds; as many, alike.

    Light is one for all views of a piece of work, cameras are moved each by itself.
    """
    some = (torch.rand(len(pictures)) >= UNCHANGED).nonzero()[:, 0].to(pictures.device)
    changed = pictures.clone()
    changed[some] = _changed(pictures[some], strength)
    return changed


def _changed(pictures: Tensor, strength: float) -> Tensor:
    b, v, height, width, _ = pictures.shape
    x = pictures.flatten(0, 1).permute(0, 3, 1, 2).to(torch.float32).contiguous()
    x = _before_another(x, strength)
    x = _moved(x, strength)
    hue, light = (_between(b, 1, 1).repeat_interleave(v, dim=0).to(x) * strength for _ in range(2))
    x = _turned_hues(x, HUE * hue) * torch.exp(BRIGHTNESS * light)[:, None]
    x = _hidden(x, strength)
    some = (torch.rand(b * v) < BLURRED * strength).nonzero()[:, 0].to(x.device)
    x[some] = torch.lerp(x[some], _blurred(x[some]), torch.rand(len(some), 1, 1, 1).to(x))
    x = _of_nothing(x, v, strength)
    x = x + torch.randn_like(x) * (NOISE * strength * torch.rand(b * v, 1, 1, 1)).to(x)
    return x.clamp_(0, 255).round_().to(torch.uint8).permute(0, 2, 3, 1).reshape(b, v, height, width, 3)


def _between(*shape: int) -> Tensor:
    """Numbers drawn uniformly from -1 to 1."""
    return 2 * torch.rand(shape) - 1


def _before_another(x: Tensor, strength: float) -> Tensor:
    """Some pictures (n, 3, H, W) before another background: a colour, with blots of a few sizes."""
    some = (torch.rand(len(x)) < BACKGROUND * strength).nonzero()[:, 0].to(x.device)
    chosen, n = x[some], len(some)
    corners = chosen[:, :, :: x.shape[2] - 1, :: x.shape[3] - 1].mean(dim=(2, 3), keepdim=True)
    behind = (chosen - corners).abs().amax(dim=1, keepdim=True) < NEAR
    scene = 255 * torch.rand(n, 3, 1, 1) * torch.rand(n, 1, 1, 1)
    scene = torch.where(torch.rand(n, 1, 1, 1) < 0.5, scene, 255 - scene)
    for side, colours in ((3, 3), (11, 1)):
        blots = torch.randn(n, colours, side, side) * 40 * torch.rand(n, 1, 1, 1)
        scene = scene + functional.interpolate(blots, x.shape[2:], mode="bilinear")
    x[some] = torch.where(behind, scene.to(x), chosen)
    return x


def _of_nothing(x: Tensor, views: int, strength: float) -> Tensor:
    """Some pictures (n, 3, H, W), all views of a piece of work, replaced by blots from one size to a pixel's."""
    some = (torch.rand(len(x) // views) < NOTHING * strength).repeat_interleave(views).nonzero()[:, 0].to(x.device)
    n, side = len(some), int(2 ** torch.randint(1, 7, ()))
    blots = functional.interpolate(torch.randn(n, 3, side, side), x.shape[2:], mode="bilinear")
    x[some] = (255 * torch.rand(n, 3, 1, 1) + 90 * torch.rand(n, 1, 1, 1) * blots).to(x)
    return x


def _moved(x: Tensor, strength: float) -> Tensor:
    """Turned, nearer or farther, and off its place: (n, 3, H, W)."""
    n = len(x)
    angle, size = math.radians(ROTATION) * strength * _between(n), torch.exp(ZOOM * strength * _between(n))
    cos, sin = angle.cos() / size, angle.sin() / size
    shift = 2 * SHIFT * strength * _between(n, 2)
    theta = torch.stack([cos, -sin, shift[:, 0], sin, cos, shift[:, 1]], dim=1).reshape(n, 2, 3)
    grid = functional.affine_grid(theta.to(x), list(x.shape), align_corners=False)
    return functional.grid_sample(x, grid, padding_mode="border", align_corners=False)


def _turned_hues(x: Tensor, share: Tensor) -> Tensor:
    """Pictures (n, 3, H, W) with all hues turned by a share of the colour circle, (n, 1, 1); the rest of HSV stays."""
    red, green, blue = x.unbind(1)
    most = x.amax(dim=1)
    spread = (most - x.amin(dim=1)).clamp(min=1e-3)
    sixth = torch.where(most == green, (blue - red) / spread + 2, (red - green) / spread + 4)
    sixth = torch.where(most == red, (green - blue) / spread, sixth) + 6 * share
    corner = torch.stack([(sixth + n) % 6 for n in (5, 3, 1)], dim=1)
    return most[:, None] - spread[:, None] * torch.minimum(corner, 4 - corner).clamp(0, 1)


def _hidden(x: Tensor, strength: float) -> Tensor:
    """A small rectangle of some colour before some pictures."""
    n, _, height, width = x.shape
    reach = OCCLUDER / 2 * (0.3 + 0.7 * torch.rand(2, n, 1)) * (torch.rand(n, 1) < HIDDEN * strength)
    middle = torch.rand(2, n, 1)
    rows, columns = (((torch.arange(m) + 0.5) / m - middle[k]).abs() < reach[k] for k, m in enumerate((height, width)))
    there = (rows[:, None, :, None] & columns[:, None, None, :]).to(x.device)
    return torch.where(there, (255 * torch.rand(n, 3, 1, 1)).to(x), x)


def _blurred(x: Tensor) -> Tensor:
    """Out of focus by about a pixel: binomial weights of 5 x 5, as sums, ten times faster than convolutions here."""
    for axis in (2, 3):
        for _ in range(2):
            near = torch.cat([x.narrow(axis, 0, 1), x, x.narrow(axis, -1, 1)], dim=axis)
            size = x.shape[axis]
            x = (near.narrow(axis, 0, size) + near.narrow(axis, 2, size)) / 4 + x / 2
    return x
