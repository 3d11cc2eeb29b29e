package org.volprep.viewer;

import android.app.Activity;
import android.content.res.AssetFileDescriptor;
import android.os.Bundle;
import android.widget.Toast;
import java.io.FileInputStream;
import java.io.IOException;
import java.nio.ByteBuffer;
import java.nio.channels.FileChannel;

/** Shows the package assets/volume.volpkg.zip. */
public final class VolumeActivity extends Activity {
    private VolumeView view;

    @Override
    protected void onCreate(Bundle state) {
        super.onCreate(state);
        try {
            view = new VolumeView(this, mapped("volume.volpkg.zip"));
            setContentView(view);
        } catch (IOException error) {
            Toast.makeText(this, error.getMessage(), Toast.LENGTH_LONG).show();
        }
    }

    @Override
    protected void onPause() {
        super.onPause();
        if (view != null) view.onPause();
    }

    @Override
    protected void onResume() {
        super.onResume();
        if (view != null) view.onResume();
    }

    private ByteBuffer mapped(String name) throws IOException {
        try (AssetFileDescriptor asset = getAssets().openFd(name);
                FileInputStream file = new FileInputStream(asset.getFileDescriptor())) {
            return file.getChannel().map(FileChannel.MapMode.READ_ONLY, asset.getStartOffset(), asset.getLength());
        }
    }
}
