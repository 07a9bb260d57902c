"""Converter of the colour model: TFLite files of the npm package to one ONNX file."""
