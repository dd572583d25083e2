from .encoders import Encoder as Encoder, encoder_names as encoder_names, register_encoder as register_encoder
from .graph_network import GraphConfig as GraphConfig
from .graph_prior import GraphSinkhorn as GraphSinkhorn
from .network_prior import NetworkPrior as NetworkPrior
from .sinkhorn import gumbel_sinkhorn as gumbel_sinkhorn, log_sinkhorn as log_sinkhorn
from .train_config import TrainConfig as TrainConfig
from .training import FitProgress as FitProgress
