"""Run in Blender: saves preferences without the splash screen, which would lie over the window."""

import bpy

bpy.context.preferences.view.show_splash = False
bpy.ops.wm.save_userpref()
