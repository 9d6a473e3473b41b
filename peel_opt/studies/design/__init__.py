"""The material that meets a target."""
