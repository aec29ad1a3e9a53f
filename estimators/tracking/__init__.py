"""The toolbox that estimators of targets share: one small role per module, composed by constructor."""
