//: After the run of samples: a ray that is done looks no further.
//#part termination
}
