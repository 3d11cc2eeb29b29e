"""Compressed forms that were tried. The plan decides by them; the origin and the report list them."""

from typing import Annotated

from pydantic import Field

from volprep_formats.package.parts.compression.record import CompressedForm
from volprep_formats.package.values import Sha256


class FormTrial(CompressedForm):
    """A compressed form of the finest level that was tried."""

    flip: Annotated[float, Field(ge=0.0)] | None = None
    """Largest FLIP of a picture, over black or white; only of a volume in colour."""
    seconds: Annotated[float, Field(ge=0.0)] | None = None
    """Time for encoding the level; None if a sample was enough."""
    key: Sha256 | None = None
    """Digest of all that it depends on; none where a sample was enough, which is as quickly done again."""

    @property
    def as_record(self) -> CompressedForm:
        """The record for a manifest, whose bytes must not depend on a clock."""
        return CompressedForm.model_validate(self.model_dump(exclude={"flip", "seconds", "key"}))
