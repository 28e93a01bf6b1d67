//! Everything this program asks of OpenCV. No other file names the bindings.
