from .explore import Explorer as Explorer, explore as explore, frame as frame, page_of as page_of
from .javascript import Script as Script, model_script as model_script
from .kernel import kernel_script as kernel_script
