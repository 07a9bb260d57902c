# Writes tiny.npz and tiny_stored.npz with numpy, as users do: own content.
import numpy as np
depth=(1000+np.arange(2*4*5)).reshape(2,4,5).astype(np.uint16)
K=np.array([[5,0,2],[0,6,1.5],[0,0,1.0]]).T.copy().T  # columns first in memory
rgb=np.arange(2*4*5*3).reshape(2,4,5,3).astype(np.uint8)
np.savez_compressed('tiny.npz',depth=depth,K=K,rgb=rgb)
np.savez('tiny_stored.npz',depth=depth.astype(np.float32)/1000,K=K)
