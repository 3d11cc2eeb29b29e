package org.volprep.viewer;

import android.content.Context;
import android.opengl.GLSurfaceView;
import android.util.Log;
import android.view.MotionEvent;
import java.nio.ByteBuffer;
import javax.microedition.khronos.egl.EGLConfig;
import javax.microedition.khronos.opengles.GL10;

/** A view that draws a package, and turns it as a finger moves. */
public final class VolumeView extends GLSurfaceView implements GLSurfaceView.Renderer {
    private final ByteBuffer data;
    private float lastX;
    private float lastY;
    private boolean failed;

    public VolumeView(Context context, ByteBuffer data) {
        super(context);
        this.data = data;
        told(Volume.open(data));
        setEGLContextClientVersion(3);
        setRenderer(this);
        setRenderMode(RENDERMODE_WHEN_DIRTY);
    }

    @Override
    public boolean onTouchEvent(MotionEvent event) {
        float x = event.getX();
        float y = event.getY();
        if (event.getActionMasked() == MotionEvent.ACTION_MOVE) {
            float perPixel = (float) Math.PI / Math.min(getWidth(), getHeight());
            float across = (x - lastX) * perPixel;
            float down = (y - lastY) * perPixel;
            queueEvent(() -> Volume.turn(across, down));
            requestRender();
        }
        lastX = x;
        lastY = y;
        return true;
    }

    @Override
    public void onSurfaceCreated(GL10 unused, EGLConfig config) {}

    /** A new surface may come with a new context: everything is made again. */
    @Override
    public void onSurfaceChanged(GL10 unused, int width, int height) {
        told(Volume.resize(width, height));
    }

    @Override
    public void onDrawFrame(GL10 unused) {
        if (!failed) told(Volume.draw());
    }

    private void told(String error) {
        if (error.isEmpty()) return;
        failed = true;
        Log.e("volume", error);
    }
}
