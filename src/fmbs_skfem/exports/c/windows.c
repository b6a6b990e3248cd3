/* What a library of Windows needs where no C library is linked. Compile it with -fno-builtin: its loops are what they are to replace. */
#include <stddef.h>

int _fltused = 0;

int __stdcall DllMainCRTStartup(void *library, unsigned long reason, void *reserved)
{
    (void)library;
    (void)reason;
    (void)reserved;
    return 1;
}

void *memcpy(void *to, const void *from, size_t size)
{
    for (size_t k = 0; k < size; k++)
        ((unsigned char *)to)[k] = ((const unsigned char *)from)[k];
    return to;
}

void *memmove(void *to, const void *from, size_t size)
{
    if (to <= from)
        return memcpy(to, from, size);
    while (size-- > 0)
        ((unsigned char *)to)[size] = ((const unsigned char *)from)[size];
    return to;
}

void *memset(void *to, int value, size_t size)
{
    for (size_t k = 0; k < size; k++)
        ((unsigned char *)to)[k] = (unsigned char)value;
    return to;
}
