"""The burst's files: time series for ParaView, checkpoint, snapshot for the break-up."""
