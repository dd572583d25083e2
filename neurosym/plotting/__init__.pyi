from .curves import Curves as Curves, Spread as Spread, curves_figure as curves_figure
from .density import density_figure as density_figure, kernel_density as kernel_density
from .errors import (
    classes_figure as classes_figure,
    confusion_figure as confusion_figure,
    repeats_figure as repeats_figure,
)
from .graphs import blocking_figure as blocking_figure, contact_figure as contact_figure
from .iterations import LAST_BAR as LAST_BAR, iterations_figure as iterations_figure
from .learning import learning_figure as learning_figure
from .points import Panel as Panel, points_figure as points_figure
from .scores import scores_figure as scores_figure
from .search import search_figure as search_figure
from .style import COLOURS as COLOURS, COLUMN as COLUMN, look_of as look_of, save as save, save_both as save_both
