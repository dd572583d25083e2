"""Encoders: from the pictures of one piece of finished work to a feature vector. Chosen by name.

`prepare` is fixed work without parameters (pooling, rearranging) that training does once, before its epochs;
`forward` is what is learned.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from itertools import pairwise
from typing import ClassVar

import torch
from torch import Tensor, nn
from torch.nn import functional

from neurosym.errors import InputError, MissingDependencyError, UnknownNameError

#: (V, H, W, 3): views, height, width, colours.
PictureShape = tuple[int, int, int, int]


class Encoder(nn.Module, ABC):
    """Pictures -> features.

    `out_features`: length of the feature vector. `places_shape`: (V, R, C, 3), what `places` gives of each.
    """

    out_features: int
    places_shape: tuple[int, int, int, int]

    @abstractmethod
    def prepare(self, pictures: Tensor) -> Tensor:
        """uint8 (B, V, H, W, 3) -> whatever `forward` takes, first axis B; no picture depends on its neighbours."""

    def reduced(self, pictures: Tensor) -> Tensor:
        """uint8 (B, V, H, W, 3) -> the same with as many pixels as changes of them need before `prepare` has them."""
        return pictures

    @abstractmethod
    def forward(self, prepared: Tensor) -> Tensor:
        """What `prepare` gave -> float (B, out_features)."""

    @abstractmethod
    def places(self, prepared: Tensor) -> Tensor:
        """What `prepare` gave -> mean colours of the places of a coarse grid, about -1 to 1: (B, V, R, C, 3)."""


class SmallEncoder(Encoder):
    """Mean-pools each view to 16 x 16, one perceptron shared by the views, then one over all views.

    A view at least twice as long as wide (a row of tiles) is cut into squares, each of which counts as a view: what is
    learned of one place then serves at all.

    On pictures of assemblies of some ten parts it is two to ten times faster than convolutions and no worse: what
    matters there is which colour is where, coarsely. Dropout 0.2 took a third off the failures on unseen Soma cubes.
    """

    SIDE = 16
    #: Of a square view where pictures are changed by chance: at 64 that would take four times as long.
    CHANGED: ClassVar[int] = 32

    def __init__(
        self, shape: PictureShape, *, hidden: int = 192, view: int = 96, out_features: int = 256, dropout: float = 0.2
    ) -> None:
        super().__init__()
        self.out_features = out_features
        self.down, self.across = max(shape[1] // shape[2], 1), max(shape[2] // shape[1], 1)
        views = shape[0] * self.down * self.across
        self.places_shape = (views, self.SIDE, self.SIDE, 3)
        self.each = nn.Sequential(nn.Linear(3 * self.SIDE**2, hidden), nn.ReLU(), nn.Linear(hidden, view), nn.ReLU())
        self.all = nn.Sequential(
            nn.Dropout(dropout), nn.Linear(views * view, out_features), nn.ReLU(), nn.Dropout(dropout)
        )

    def reduced(self, pictures: Tensor) -> Tensor:
        rows, columns = (min(self.CHANGED * n, s) for n, s in zip((self.down, self.across), pictures.shape[2:4]))
        pooled = _pooled(pictures.flatten(0, 1), rows, columns).round().to(torch.uint8)
        return pooled.reshape(*pictures.shape[:2], rows, columns, 3)

    def prepare(self, pictures: Tensor) -> Tensor:
        pooled = _pooled(pictures.flatten(0, 1), self.SIDE * self.down, self.SIDE * self.across)
        squares = pooled.reshape(-1, self.down, self.SIDE, self.across, self.SIDE, 3).transpose(2, 3)
        return _centred(squares).reshape(len(pictures), -1, 3 * self.SIDE**2)

    def forward(self, prepared: Tensor) -> Tensor:
        features: Tensor = self.all(self.each(prepared).flatten(1))
        return features

    def places(self, prepared: Tensor) -> Tensor:
        return prepared.reshape(len(prepared), *self.places_shape)


class ConvEncoder(SmallEncoder):
    """As the small one, but two convolutions look at 32 x 32 places of each view before the perceptrons.

    They need not learn a colour at every place by itself: of pictures that are changed by chance they learn more.
    """

    SIDE = 32
    CHANNELS = 16, 32

    def __init__(self, shape: PictureShape, *, view: int = 96, out_features: int = 256, dropout: float = 0.1) -> None:
        super().__init__(shape, hidden=1, view=view, out_features=out_features, dropout=dropout)
        near, far = self.CHANNELS
        layers = nn.Conv2d(3, near, 3, 2, padding=1), nn.ReLU(), nn.Conv2d(near, far, 3, 2, padding=1), nn.ReLU()
        self.each = nn.Sequential(*layers, nn.Flatten(), nn.Linear(far * (self.SIDE // 4) ** 2, view), nn.ReLU())

    def forward(self, prepared: Tensor) -> Tensor:
        views = prepared.reshape(-1, self.SIDE, self.SIDE, 3).permute(0, 3, 1, 2)
        features: Tensor = self.all(self.each(views).reshape(len(prepared), -1))
        return features


class _Stacked(Encoder):
    """An encoder of views stacked as channels; they stay bytes until they are read, so that thousands stay resident."""

    NAME: ClassVar[str]
    LEAST: ClassVar[int]  #: pixels of the shorter side; below, the convolutions leave too little

    def __init__(self, shape: PictureShape, out_features: int) -> None:
        super().__init__()
        views, height, width, _ = shape
        if min(height, width) < self.LEAST:
            raise InputError(
                f"Expected pictures of at least {self.LEAST} x {self.LEAST} pixels for the encoder {self.NAME!r}; "
                f"got {height} x {width}. Use encoder='small', or larger pictures."
            )
        self.out_features = out_features
        self.places_shape = (views, SmallEncoder.SIDE, SmallEncoder.SIDE, 3)

    def prepare(self, pictures: Tensor) -> Tensor:
        return pictures.permute(0, 1, 4, 2, 3).flatten(1, 2).contiguous()  # uint8 (B, 3 V, H, W)

    def places(self, prepared: Tensor) -> Tensor:
        views, rows, columns, _ = self.places_shape
        pooled = functional.adaptive_avg_pool2d(prepared.to(torch.float32), (rows, columns))
        return _centred(pooled).reshape(-1, views, 3, rows, columns).permute(0, 1, 3, 4, 2)


class PaperEncoder(_Stacked):
    """The convolutional network of Burke et al. (RA-L 2021, appendix), views stacked as channels (12 for Soma).

    32, 64, pool, 128, pool, 256, pool (kernels 5 x 5, unpadded, ReLU; pools 2 x 2), dropout 0.5, 128 neurons, ReLU.
    """

    NAME, LEAST = "paper", 40

    def __init__(self, shape: PictureShape) -> None:
        super().__init__(shape, 128)
        layers: list[nn.Module] = []
        for before, after in pairwise((shape[0] * shape[3], 32, 64, 128, 256)):
            layers += [nn.Conv2d(before, after, 5), nn.ReLU()]
            if after > 32:
                layers.append(nn.MaxPool2d(2))
        self.convolutions = nn.Sequential(*layers)
        rows, columns = ((((side - 8) // 2 - 4) // 2 - 4) // 2 for side in shape[1:3])
        self.dense = nn.Sequential(nn.Dropout(0.5), nn.Linear(256 * rows * columns, self.out_features), nn.ReLU())

    def forward(self, prepared: Tensor) -> Tensor:
        features: Tensor = self.dense(self.convolutions(_centred(prepared)).flatten(1))
        return features


class ResNetEncoder(_Stacked):
    """ResNet18 (He et al., CVPR 2016) of torchvision, untrained, views stacked as channels.

    Made for pictures of 224 pixels, it shrinks them 32 times. Here the first strides are left out, the pooling one
    and then that of the first convolution, until at least 4 x 4 places are left: 64 pixels are shrunk 16 times.
    Raises `MissingDependencyError` where torchvision is not installed.
    """

    NAME, LEAST = "resnet18", 16
    PLACES = 4

    def __init__(self, shape: PictureShape) -> None:
        super().__init__(shape, 512)
        try:
            from torchvision.models import resnet18
        except ImportError:
            raise MissingDependencyError(
                "Expected torchvision for the encoder 'resnet18'; it is not installed. "
                "Install this package with its extra `vision`, or use encoder='small' or 'paper'."
            ) from None
        network: nn.Module = resnet18(weights=None)
        side = min(shape[1:3])
        pooled, halved = side >= 32 * self.PLACES, side >= 16 * self.PLACES
        kernel, stride = (7, 2) if pooled else (3, 2) if halved else (3, 1)
        network.conv1 = nn.Conv2d(shape[0] * shape[3], 64, kernel, stride, padding=kernel // 2, bias=False)
        if not pooled:
            network.maxpool = nn.Identity()
        network.fc = nn.Identity()
        self.network = network

    def forward(self, prepared: Tensor) -> Tensor:
        features: Tensor = self.network(_centred(prepared))
        return features


def _centred(colours: Tensor) -> Tensor:
    """Colours of 0 to 255, brought to -1 to 1 in float32."""
    return (colours.to(torch.float32) - 127.5) / 127.5


def _pooled(views: Tensor, rows: int, columns: int) -> Tensor:
    """Mean colours: uint8 (B, H, W, 3) -> float32 (B, rows, columns, 3)."""
    height, width = views.shape[1:3]
    if height % rows or width % columns:
        pooled = functional.adaptive_avg_pool2d(views.permute(0, 3, 1, 2).to(torch.float32), (rows, columns))
        return pooled.permute(0, 2, 3, 1)
    # Sums of integers, rows first: exact, and eight times faster than pooling floats.
    down, across = height // rows, width // columns
    kind = torch.int16 if 255 * down * across <= torch.iinfo(torch.int16).max else torch.int32
    lines = views.reshape(-1, rows, down, width * 3)
    summed = sum((lines[:, :, i] for i in range(1, down)), lines[:, :, 0].to(kind))
    places = summed.reshape(-1, rows, columns, across, 3)
    total = sum((places[..., i, :] for i in range(1, across)), places[..., 0, :])
    return total.to(torch.float32) / (down * across)


#: A factory takes the picture shape and gives an encoder.
EncoderFactory = Callable[[PictureShape], Encoder]

_ENCODERS: dict[str, EncoderFactory] = {
    "small": SmallEncoder,
    "conv": ConvEncoder,
    "paper": PaperEncoder,
    "resnet18": ResNetEncoder,
}


def register_encoder(name: str, factory: EncoderFactory) -> None:
    """Make an encoder known by name; weights that name it can be loaded wherever it is registered first."""
    if name in _ENCODERS and _ENCODERS[name] is not factory:
        raise InputError(f"Expected a name that no encoder has yet; got {name!r}. Known: {', '.join(encoder_names())}.")
    _ENCODERS[name] = factory


def encoder_names() -> list[str]:
    """Names that `build_encoder` takes."""
    return sorted(_ENCODERS)


def build_encoder(name: str, shape: PictureShape) -> Encoder:
    """The encoder of that name for pictures of that shape. Raises `UnknownNameError`, which lists the names."""
    if name not in _ENCODERS:
        raise UnknownNameError("picture encoder", name, _ENCODERS)
    return _ENCODERS[name](shape)
