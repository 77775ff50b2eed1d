from .explore import Explorer as Explorer, explore as explore, frame as frame, page_of as page_of
