"""The material numbers that fit what was measured."""
