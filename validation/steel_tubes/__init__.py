"""Long steel tubes: the speed of the middle over the charge ratio, against Gurney's formula."""
