"""Second opinions: VTK draws the scan, and independent libraries read scan, scene and package again."""
