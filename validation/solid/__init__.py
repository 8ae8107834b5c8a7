"""The solid alone: waves, static and plastic tubes, an impact and a softening cell, against closed forms."""
