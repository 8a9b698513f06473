"""The hull's surface: closed meshes, volumes, emergence, added mass."""
