for (float i = 0.5; i < count; i++) {
