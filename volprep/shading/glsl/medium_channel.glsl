//: One of several channels, $OF, whose normalised stored value is $VALUE.
vec4 part$OF = classify$OF($VALUE);
medium += vec4(part$OF.rgb * part$OF.a, part$OF.a);
