// What GLSL and C++ spell differently in the files of this folder; the other half is language.hpp.
#define CONSTANT const
#define INLINE
#define IN(T) T
#define OUT(T) out T
#define INOUT(T) inout T
#define OUT_ARRAY(T, name, size) out T name[size]
#define INOUT_ARRAY(T, name, size) inout T name[size]
