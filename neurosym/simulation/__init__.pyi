from .client import Client as Client, open_clients as open_clients
from .looks import Camera as Camera, STYLES as STYLES, Style as Style, VIEWS as VIEWS
from .oracle import PhysicsOracle as PhysicsOracle
from .physics import Physics as Physics
from .render import cached_pictures as cached_pictures
from .render import PictureStudio as PictureStudio, render_many as render_many, render_views as render_views
from .replay import replay_plan as replay_plan, replay_staging as replay_staging
from .replay_report import ReplayReport as ReplayReport, StepReplay as StepReplay
from .scene import PALETTE as PALETTE
from .world import World as World, stands as stands
