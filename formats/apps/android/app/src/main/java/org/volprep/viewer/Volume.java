package org.volprep.viewer;

import java.nio.ByteBuffer;

/** The native renderer. Each call but turn returns an error in words, or an empty text. */
final class Volume {
    static {
        System.loadLibrary("volume");
    }

    private Volume() {}

    /** Opens a package in a direct buffer, which must stay as it is. */
    static native String open(ByteBuffer data);

    /** Prepares the context that is current for a surface of this size. */
    static native String resize(int width, int height);

    /** Turns the volume, in radians. */
    static native void turn(float across, float down);

    /** Draws into the framebuffer that is bound. */
    static native String draw();
}
