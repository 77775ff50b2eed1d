from .explore import Explorer as Explorer, explore as explore, frame as frame, page_of as page_of
from .javascript import Script as Script, kernel_script as kernel_script, model_script as model_script
