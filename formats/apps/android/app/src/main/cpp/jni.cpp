// The calls of Volume.java.
#include <jni.h>

#include <exception>

#include "viewer.h"

template <class Work>
static jstring told(JNIEnv* env, Work work) {
    try {
        work();
    } catch (const std::exception& error) {
        return env->NewStringUTF(error.what());
    }
    return env->NewStringUTF("");
}

extern "C" {

JNIEXPORT jstring JNICALL Java_org_volprep_viewer_Volume_open(JNIEnv* env, jclass, jobject data) {
    const void* at = env->GetDirectBufferAddress(data);
    const jlong bytes = env->GetDirectBufferCapacity(data);
    return told(env, [=] { viewer_open(at, static_cast<std::size_t>(bytes)); });
}

JNIEXPORT jstring JNICALL Java_org_volprep_viewer_Volume_resize(JNIEnv* env, jclass, jint width, jint height) {
    return told(env, [=] { viewer_resize(width, height); });
}

JNIEXPORT void JNICALL Java_org_volprep_viewer_Volume_turn(JNIEnv*, jclass, jfloat across, jfloat down) {
    viewer_turn(across, down);
}

JNIEXPORT jstring JNICALL Java_org_volprep_viewer_Volume_draw(JNIEnv* env, jclass) {
    return told(env, [] { viewer_draw(); });
}

}  // extern "C"
